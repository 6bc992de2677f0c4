"""From a finished search to its result: verdict, findings, gap, and what was not explained."""
