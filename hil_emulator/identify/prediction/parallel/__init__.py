"""Distribution of experiments over threads or a cluster, used by fits and searches."""
