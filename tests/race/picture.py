# SPDX-License-Identifier: BSD-3-Clause
"""The picture of summary.py."""
import math


def curves(path, ways, bare, best):
    """Contacts per 1,000 flights, a logarithm, against the share flown."""
    width, height, left, bottom = 640, 400, 60, 50
    low, high = math.log10(0.02), math.log10(300)

    def at(s):
        x = max(math.log10(max(s.rate(), 1e-9)), low)
        return (left + (width - left - 150) * (x - low) / (high - low), height - bottom - (height - bottom - 20) * s.share(bare))

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for power in (-1, 0, 1, 2):
        x = left + (width - left - 150) * (power - low) / (high - low)
        out.append(f'<path d="M{x:.1f} 20V{height - bottom}" stroke="#ddd"/><text x="{x:.1f}" y="{height - bottom + 16}" '
                   f'text-anchor="middle">{10.0 ** power:g}</text>')
    out.append(f'<text x="{left}" y="{height - bottom + 16}" text-anchor="middle">none</text>')
    for share in (0, 0.25, 0.5, 0.75, 1):
        y = height - bottom - (height - bottom - 20) * share
        out.append(f'<path d="M{left} {y:.1f}H{width - 150}" stroke="#ddd"/><text x="{left - 6}" y="{y + 4:.1f}" '
                   f'text-anchor="end">{share:g}</text>')
    out.append(f'<text x="{(left + width - 150) / 2}" y="{height - 12}" text-anchor="middle">contacts per 1,000 flights</text>')
    out.append(f'<text x="14" y="{height / 2}" transform="rotate(-90 14 {height / 2})" text-anchor="middle">share flown</text>')
    names = [("one constant for all", "#888", sorted(w for w in ways if w.startswith("margin"))), ("a stated risk", "#c00", [w for w in ways if w.startswith("risk")]),
             ("the worst case", "#06c", ["tight"])]
    legend = []
    for name, colour, of in names:
        points = [at(ways[w]) for w in of]
        out.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}" fill="none" stroke="{colour}"/>')
        for w in of:
            x, y = at(ways[w])
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"><title>{w}</title></circle>')
            if w.startswith("margin") and int(round(float(w[7:]) * 100)) % 10 == 0:
                out.append(f'<text x="{x + 6:.1f}" y="{y + 4:.1f}" fill="{colour}">{float(w[7:]):g} m</text>')
        legend.append((name, colour))
    for name, s in best.items():
        x, y = at(s)
        out.append(f'<path d="M{x - 5:.1f} {y:.1f}h10M{x:.1f} {y - 5:.1f}v10" stroke="#080" stroke-width="2"><title>{name}</title></path>')
    legend.append(("best of each, afterwards", "#080"))
    for n, (name, colour) in enumerate(legend):
        out.append(f'<text x="{width - 145}" y="{40 + 18 * n}" fill="{colour}">{name}</text>')
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n</svg>\n")


def reliability(path, points):
    """Exits a second that were promised against those seen, both logarithms, with their intervals."""
    size, left = 420, 60
    colours = {data: colour for data, colour in zip(dict.fromkeys(d for d, *_ in points), ("#06c", "#c00", "#e80", "#080", "#808"))}

    def at(value):
        return (size - 50 - left) * (math.log10(max(value, 1e-4)) + 4) / 4

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{size + 130}" height="{size}" font-family="sans-serif" font-size="12">',
           f'<rect width="{size + 130}" height="{size}" fill="white"/>',
           f'<path d="M{left + at(1e-4):.1f} {size - 50 - at(1e-4):.1f}L{left + at(1):.1f} {size - 50 - at(1):.1f}" stroke="#888"/>']
    for power in range(-4, 1):
        value = 10.0 ** power
        out.append(f'<text x="{left + at(value):.1f}" y="{size - 32}" text-anchor="middle">{value:g}</text>'
                   f'<text x="{left - 6}" y="{size - 46 - at(value):.1f}" text-anchor="end">{value:g}</text>')
    out.append(f'<text x="{size / 2}" y="{size - 10}" text-anchor="middle">exits a second, promised</text>'
               f'<text x="14" y="{size / 2}" transform="rotate(-90 14 {size / 2})" text-anchor="middle">seen</text>')
    for data, promised, seen, low, high in points:
        n = list(colours).index(data)
        x = left + at(promised) + 5 * n - 10
        out.append(f'<path d="M{x:.1f} {size - 50 - at(low):.1f}V{size - 50 - at(high):.1f}" stroke="{colours[data]}"/>'
                   f'<circle cx="{x:.1f}" cy="{size - 50 - at(seen):.1f}" r="4" fill="{colours[data]}"/>')
    for n, (data, colour) in enumerate(colours.items()):
        out.append(f'<text x="{size}" y="{40 + 18 * n}" fill="{colour}">{data}</text>')
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n</svg>\n")
