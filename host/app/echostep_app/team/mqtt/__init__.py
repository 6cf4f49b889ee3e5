# SPDX-License-Identifier: MIT
"""Reports over MQTT.

In: reports of a wearer. Out: publications, subscriptions. Owns the connection to the broker.
"""
