# SPDX-License-Identifier: MIT
"""Meaning of a drawing's layers by their names, and other layers whose lines look like walls.

In: names, patterns, lines in metres. Out: kinds of elements. Owns the patterns of names in many languages, and the criteria for lines of walls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np
import shapely
from shapely.geometry import LineString

from echostep.arrays import Floats, Ints
from echostep_app.plan.importers.straight import pieces_of

OPENINGS = ("*opening*", "*oeffnung*", "*öffnung*", "*ouverture*", "*abertura*", "*apertur*")  # in walls
# Names in English (AIA) and German, Romance, Germanic and Slavic languages, Turkish, Indonesian, Chinese, Japanese, Korean
LAYERS: dict[str, tuple[str, ...]] = {
    "walls": (
        "*wall*", "*partition*", "*masonry*", "*wand*", "*waend*", "*wände*", "*mauer*", "*mur*", "*cloison*", "*pared*", "*tabique*", "*parete*",
        "*pareti*", "*tramezz*", "*muur*", "*vägg*", "*vegg*", "*væg*", "*seinä*", "*scian*", "*ścian*", "*stěn*", "*стен*", "*перегород*", "*duvar*",
        "*dinding*", "*墙*", "*牆*", "*壁*", "*벽*",
    ),
    "columns": ("*cols*", "*column*", "*stütz*", "*stuetz*", "*pfeiler*", "*poteau*", "*pilar*", "*colonn*", "*колонн*", "*kolo[mn]*", "*柱*"),
    "windows": (
        "*wind*", "*glaz*", "*glas*", "*fenster*", "*ventana*", "*fenetre*", "*fenêtre*", "*finestr*", "*janela*", "*fönster*", "*vindu*", "*okno*",
        "*okna*", "*окн*", "*pencere*", "*jendela*", "*窗*", "*窓*", "*창*",
    ),
    "doors": (
        "*door*", "*tür*", "*tuer*", "*puerta*", "*porte*", "*porta*", "*deur*", "*dør*", "*dörr*", "*drzwi*", "*dveř*", "*двер*", "*pintu*", "*门*",
        "*門*", "*扉*", "*ドア*", "*문*", *OPENINGS,
    ),
    "stairs": (
        "*stair*", "*strs*", "*trepp*", "*escalier*", "*escalera*", "*scala*", "*escada*", "*schod*", "*лестн*", "*tangga*", "*楼梯*", "*階段*",
    ),
    "lifts": ("*lift*", "*elev*", "*evtr*", "*aufzug*", "*ascens*", "*лифт*", "*电梯*"),
    "rooms": ("*room*", "*raum*", "*space*", "*ruang*", "*area-iden*", "*name*"),
    "obstacles": ("*obstacle*", "*hindernis*"),
}  # fmt: skip
BESIDE = (
    "*patt*", "*hatch*", "*schraff*", "*-dim*", "*bemass*", "*bemaß*", "*anno*", "*text*", "*demol*", "*-demo*", "*abbruch*", "*insul*", "*daemm*",
    "*dämm*", "*furn*", "*möbel*", "*moebel*", "*muebl*", "*mobil*", "*sanit*", "*plumb*", "*clng*", "*ceil*", "*elec*", "*hvac*", "*equip*",
    "*tile*", "*-iden*", "*-tag*", "*-symb*", "*-abov*", "*-ovhd*", "*-cntr*", "*-head*", "*achse*", "*tapete*", "*paper*", "*finish*",
)  # fmt: skip
# Of ways out and in, which are drawn like short walls
WAYS = (
    "*exit*", "*egress*", "*escape*", "*evacu*", "*entrance*", "*entry*", "*sortie*", "*issue*", "*entree*", "*entrée*", "*salida*", "*entrada*",
    "*saida*", "*saída*", "*uscita*", "*ingresso*", "*ausgang*", "*eingang*", "*flucht*", "*uitgang*", "*ingang*", "*utgång*", "*wyjsc*", "*wyjśc*",
    "*выход*", "*出口*",
)  # fmt: skip
# Kinds whose layers come with layers of hatching or measures
DRAWN = ("walls", "columns", "windows", "doors", "stairs", "lifts")
THINNEST_M, THICKEST_M = 0.05, 0.5  # distance of the two faces of a wall; assumed
LONG_M = 1.0  # of a piece of wall
# Within this distance of a face, at most this number of other parallels: cavities, plaster, linings; assumed
CROWD_M, MOST_BESIDE = (0.65, 3)
PAIRED = 0.5  # share of the lines of a layer of walls that have such a partner; assumed
LEAST_M = 5.0  # a layer with less length of them is not a layer of walls; assumed
MOST_PIECES = 20_000  # examined pieces of one layer


def patterns_of(own: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Patterns by kind: the caller's patterns replace the usual ones."""
    return {kind: tuple(name.casefold() for name in (own.get(kind) or LAYERS[kind])) for kind in LAYERS}


def meaning(layer: str, patterns: Mapping[str, Sequence[str]]) -> str | None:
    """The kind of element on a layer of this name; None when the name matches no pattern, or denotes hatching, measures or demolition."""
    for kind, names in patterns.items():
        if matches(layer, names):
            usual = names == LAYERS[kind] and kind in DRAWN
            kind = "doors" if usual and kind == "walls" and matches(layer, OPENINGS) else kind
            return None if usual and matches(layer, BESIDE) else kind
    return None


def matches(layer: str, patterns: Sequence[str]) -> bool:
    """Whether the name of a layer matches a pattern, ignoring case."""
    name = layer.casefold()
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def faces_m(lines: Sequence[LineString]) -> float:
    """Length of the lines of a layer that look like faces of walls, 0 where most do not.

    A face has a parallel partner at the distance of a wall's thickness, and few other parallels nearby: treads, tiles, hatching have many. Half
    of the length of walls is in pieces of a metre or more: furniture is shorter.
    """
    pieces = pieces_of(lines)
    length = np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T)
    pieces, length = pieces[length > THICKEST_M], length[length > THICKEST_M]
    if length.sum() < LEAST_M or len(pieces) > MOST_PIECES or length[length >= LONG_M].sum() < 0.5 * length.sum():
        return 0.0
    spacing, beside = parallels(pieces, CROWD_M)
    paired = length[(spacing >= THINNEST_M) & (spacing <= THICKEST_M) & (beside <= MOST_BESIDE)].sum()
    return float(paired) if paired > PAIRED * length.sum() else 0.0


def parallels(pieces: Floats, most: float) -> tuple[Floats, Ints]:
    """For each piece (n, 4): distance (n,) from its middle to the nearest parallel, infinite if none is within `most`; and how many are."""
    nearest, count = np.full(len(pieces), np.inf), np.zeros(len(pieces), dtype=np.int64)
    if not len(pieces):
        return nearest, count
    tree = shapely.STRtree(shapely.linestrings(pieces.reshape(-1, 2, 2)))
    middle = (pieces[:, :2] + pieces[:, 2:]) / 2
    along = pieces[:, 2:] - pieces[:, :2]
    along = along / np.hypot(*along.T)[:, None]
    one, other = tree.query(shapely.points(middle), predicate="dwithin", distance=most)
    sine = np.abs(along[one, 0] * along[other, 1] - along[one, 1] * along[other, 0])
    start = pieces[other, :2] - middle[one]
    apart = np.abs(along[one, 0] * start[:, 1] - along[one, 1] * start[:, 0])
    beside = (sine < 0.02) & (apart > 1e-3 * most)
    np.minimum.at(nearest, one[beside], apart[beside])
    np.add.at(count, one[beside], 1)
    return nearest, count
