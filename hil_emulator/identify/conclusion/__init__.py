"""Result of a finished search: verdict, findings, gap, and unexplained terms."""
