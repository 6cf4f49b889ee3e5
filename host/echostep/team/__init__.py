"""Teams: several trackers' estimates meet at a commander."""
