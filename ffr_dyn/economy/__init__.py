"""The cheapest model of a scene that meets a tolerance: estimates, search, report, and models that change during a run."""
