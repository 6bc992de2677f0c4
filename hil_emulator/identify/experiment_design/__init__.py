"""Experiments: a library of them, which one to run next, and hidden effects to practise on."""
