"""The reference pages of `docs/reference`, generated from the declarations of the package."""
