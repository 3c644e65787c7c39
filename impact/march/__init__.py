"""The march over time: contact laws, compiled loops, memories of the past, the stepper."""
