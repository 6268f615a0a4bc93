"""The application: the questionnaire, the dashboard and the command line."""
