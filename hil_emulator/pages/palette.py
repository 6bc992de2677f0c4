"""Colours of the pictures, which remain distinguishable with impaired colour vision."""

BLUE, VERMILION, GREEN, PINK, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
BLACK, GREY = "#000000", "#999999"
"""M. Okabe and K. Ito, Color Universal Design, 2008; the grey is an addition (assumed)."""
