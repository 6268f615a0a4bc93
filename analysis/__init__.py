"""The analysis: from a table of responses to tables, figures and a report."""
