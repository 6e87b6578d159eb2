"""Gear trains and planetary sets in catalogue terms; machines follow from them.

Units are kg, um, ms and N, which go together: 1 N accelerates 1 kg by 1 um/ms^2. A rotation is a
displacement at the base circle, in um, or an angle in mrad with base radii in mm.
"""
