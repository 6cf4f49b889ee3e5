"""Reports to a commander over MQTT and Cursor-on-Target, and the commander's view.

In: estimates. Out: reports on the wire; from the wire, a roster of the team. Owns connections and the outbox.
"""
