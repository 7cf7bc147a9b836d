"""Makes the editor's fonts: Latin, Greek and Cyrillic of Inter with tabular figures as the default ones.

    pip install fonttools
    python subset.py Inter_400Regular.ttf Inter-Regular.ttf
    python subset.py Inter_600SemiBold.ttf Inter-SemiBold.ttf

The static instances are those of the npm package @expo-google-fonts/inter 0.4.2.
"""

import sys

from fontTools import subset
from fontTools.ttLib import TTFont

RANGES = [
    (0x20, 0x7E),
    (0xA0, 0x24F),
    (0x370, 0x3FF),
    (0x400, 0x4FF),
    (0x2010, 0x203A),
    (0x20AC, 0x20AC),
    (0x2122, 0x2122),
    (0x2190, 0x2199),
    (0x2212, 0x2212),
    (0x221E, 0x221E),
    (0x2248, 0x2265),
    (0x25A0, 0x25FF),
]
TABULAR = {*range(0x30, 0x3A)}


def tabular(font):
    """Glyphs that the font's own feature for tabular figures swaps in."""
    table = font["GSUB"].table
    swaps = {}
    for record in table.FeatureList.FeatureRecord:
        if record.FeatureTag == "tnum":
            for index in record.Feature.LookupListIndex:
                for lookup in table.LookupList.Lookup[index].SubTable:
                    lookup = getattr(lookup, "ExtSubTable", lookup)
                    swaps.update(getattr(lookup, "mapping", {}))
    return swaps


def main(source, target):
    font = TTFont(source)
    swaps = tabular(font)
    for table in font["cmap"].tables:
        for code, glyph in list(table.cmap.items()):
            if code in TABULAR:
                table.cmap[code] = swaps.get(glyph, glyph)
    options = subset.Options()
    options.layout_features = ["kern", "mark", "mkmk", "ccmp", "locl"]
    options.name_IDs = ["*"]
    options.hinting = False
    options.notdef_outline = True
    options.drop_tables += ["STAT", "DSIG", "meta"]
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=[code for first, last in RANGES for code in range(first, last + 1)])
    subsetter.subset(font)
    font.save(target)


if __name__ == "__main__":
    main(*sys.argv[1:])
