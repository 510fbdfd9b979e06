"""From a model of any kind to the body: the method from end to end."""
