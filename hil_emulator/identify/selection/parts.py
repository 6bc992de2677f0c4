"""Parts of a whole from which on it is one thing or the other, the same in every question."""

GREATER_PART = 0.5
"""Of what is explained, or of a squared cosine: who has more of it than all others together does
the work, so that no other value could be meant."""

SMALL_PART = 0.1
"""What hardly counts beside the rest (assumed)."""
