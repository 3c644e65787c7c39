"""What is known of a body before any model of it: struck patch, surrogate, element sizes, cost."""
