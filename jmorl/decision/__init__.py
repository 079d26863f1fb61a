"""Who chooses: the decision maker's protocol, artificial and human users, E-NAUTILUS."""
