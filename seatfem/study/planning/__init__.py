"""Which model a scene requires for the accuracy it asks for: every open key chosen, with reason, cost and error."""
