"""From a gear set to a lumped system."""
