# SPDX-License-Identifier: MIT
"""Building models (IFC): the model, its storeys, the openings of its doors.

In: an .ifc file, or one packed as .ifczip. Out: a plan. Owns nothing.
"""
