"""How far apart colours look, to people with and without a colour vision deficiency."""

# Simulation of dichromats in linear RGB: Machado, Oliveira, Fernandes, "A physiologically-based
# model for simulation of color vision deficiency", IEEE TVCG 15(6), 2009, severity 1.0.
VISIONS = {
    "normal": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
    "tritanopia": ((1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)),
}

# sRGB to XYZ, IEC 61966-2-1; its white is D65.
XYZ = ((0.4124, 0.3576, 0.1805), (0.2126, 0.7152, 0.0722), (0.0193, 0.1192, 0.9505))


def times(matrix, vector):
    return [sum(m * v for m, v in zip(row, vector)) for row in matrix]


def linear(colour):
    return [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in colour]


def lab(colour, vision):
    """CIELAB of an sRGB colour (0 to 1) as it looks."""
    seen = [min(1, max(0, v)) for v in times(VISIONS[vision], linear(colour))]
    white = times(XYZ, (1, 1, 1))
    f = [t ** (1 / 3) if t > (6 / 29) ** 3 else t / 3 / (6 / 29) ** 2 + 4 / 29
         for t in (v / w for v, w in zip(times(XYZ, seen), white))]
    return 116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])


def difference(a, b, vision="normal"):
    """CIE 1976 colour difference."""
    return sum((x - y) ** 2 for x, y in zip(lab(a, vision), lab(b, vision))) ** 0.5


def contrast(a, b):
    """WCAG 2.2."""
    x, y = (times(XYZ, linear(colour))[1] for colour in (a, b))
    return (max(x, y) + 0.05) / (min(x, y) + 0.05)
