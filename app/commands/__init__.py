"""One file a verb of `subdermal`; each exposes `command`."""
