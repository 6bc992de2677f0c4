"""Where model and measurement disagree: by channel, balance and region."""
