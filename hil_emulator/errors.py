"""The one exception that is meant for the user."""


class UserError(Exception):
    """Something the user can mend: says what is wrong, where, and what to do.

    The command line prints its text without a traceback and ends with exit code 2.
    """
