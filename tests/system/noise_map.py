# SPDX-License-Identifier: BSD-3-Clause
"""An OctoMap in which nothing can be left out: each voxel is free or unknown by chance, a few are occupied.

    noise_map.py FILE BYTES

Whole cubes of 64 voxels a side, 75 kB each and one like the other, and the least of them that have so many bytes in all.
"""
import random
import sys

UNKNOWN, FREE, OCCUPIED, INNER = 0, 1, 2, 3  # as the two bits of a child
CUBE, ROOT = 6, 16  # levels of a cube, and of a tree


def node(children: list[int]) -> bytes:
    return sum(child << (2 * n) for n, child in enumerate(children)).to_bytes(2, "little")


def cube() -> tuple[bytes, int]:
    """A full tree, depth first: a node's eight children in two bytes, then each of those that are inner nodes. And its nodes."""
    draw = random.Random(1)
    some = [draw.choices([UNKNOWN, OCCUPIED, FREE], weights=[48, 4, 48], k=8) for _ in range(4096)]
    some = [children for children in some if any(children)]  # an inner node has a child that is known
    drawn = draw.choices(some, k=8 ** (CUBE - 1))
    count = sum(8 - children.count(UNKNOWN) for children in drawn)
    trees = [node(children) for children in drawn]
    for _ in range(CUBE - 1):
        count += len(trees)
        trees = [node([INNER] * 8) + b"".join(trees[n:n + 8]) for n in range(0, len(trees), 8)]
    return trees[0], count + 1


def tree(levels: int, one: tuple[bytes, int], count: int) -> tuple[bytes, int]:
    """`count` cubes below a node of so many levels, and the nodes of all."""
    if levels == CUBE:
        return one
    each = 8 ** (levels - 1 - CUBE)
    parts = [tree(levels - 1, one, min(each, count - n)) for n in range(0, count, each)]
    return node([INNER] * len(parts)) + b"".join(part[0] for part in parts), 1 + sum(part[1] for part in parts)


def main() -> None:
    one = cube()
    data, nodes = tree(ROOT, one, -(-int(sys.argv[2]) // len(one[0])))
    with open(sys.argv[1], "wb") as file:
        file.write(b"# Octomap OcTree binary file\nid OcTree\nsize %d\nres 0.1\ndata\n" % nodes + data)


if __name__ == "__main__":
    main()
