"""The equilibrium of a scene: by Newton's method, and from far away by letting it fall and stopping it."""
