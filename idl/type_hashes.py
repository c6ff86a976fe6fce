#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Type hashes of the messages of idl/ as ROS 2 has them since Iron (REP 2016, "RIHS01"), for services/dds.

type_hashes.py [SOURCE_DIR]          prints the header that the build includes
type_hashes.py SOURCE_DIR --check    1 if a hash is not the one that ROS 2 publishes

A hash is SHA-256 of the type's description: names and types of its members in order, and those of all types below it.
"""
import hashlib
import json
import pathlib
import re
import sys

# type_description_interfaces/msg/FieldType: of a single value; an array adds 48, a bounded sequence 96, another 144.
IDS = {"int8": 2, "uint8": 3, "long": 6, "unsigned long": 7, "unsigned long long": 9, "float": 10, "double": 11,
       "boolean": 15, "octet": 16, "string": 17}
NESTED, ARRAY, BOUNDED, UNBOUNDED = 1, 48, 96, 144

# As ROS 2 Jazzy itself says them (`ros2 topic info --verbose`, metadata.yaml of rosbag2), collected from public sources.
# Of octomap_msgs none was found.
PUBLISHED = {
    "diagnostic_msgs/msg/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "geometry_msgs/msg/PoseStamped": "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    "geometry_msgs/msg/TransformStamped": "0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206",
    "nav_msgs/msg/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "nav_msgs/msg/Path": "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    "sensor_msgs/msg/BatteryState": "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    "sensor_msgs/msg/PointCloud2": "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "visualization_msgs/msg/MarkerArray": "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
}

HEAD = """// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>

#include "backwash_msgs.h"

/// Written by idl/type_hashes.py.
namespace backwash::dds {

/// Of all of idl/, for who takes any type by its name.
inline const dds_topic_descriptor_t* const kDescriptors[] = {
%s};

struct TypeHash {
  std::string_view type, hash;
};

inline constexpr TypeHash kTypeHashes[] = {
"""
TAIL = """};

/// What ROS 2's tools compare types by, of a type by its name on the wire; empty: of one that is not of idl/.
constexpr std::string_view type_hash(std::string_view type) {
  const auto* const found = std::ranges::find(kTypeHashes, type, &TypeHash::type);
  return found == std::end(kTypeHashes) ? std::string_view() : found->hash;
}

}  // namespace backwash::dds
"""


def field(member: str, package: str) -> dict:
    type_, name, count = re.fullmatch(r"(.+?)\s+(\w+)(?:\[(\d+)\])?", member, re.S).groups()
    more = ARRAY if count else 0
    if many := re.fullmatch(r"sequence<(.+?)(?:, *(\d+))?>", type_):
        type_, count, more = many[1], many[2], BOUNDED if many[2] else UNBOUNDED
    nested = ""
    if type_ not in IDS:
        scoped = re.fullmatch(r"(?:(\w+)::msg::dds_::)?(\w+)_", type_)
        nested = f"{scoped[1] or package}/msg/{scoped[2]}"
    return {"name": name, "type": {"type_id": IDS.get(type_, NESTED) + more, "capacity": int(count or 0),
                                   "string_capacity": 0, "nested_type_name": nested}}


def types_of(text: str) -> dict[str, dict]:
    bare, types = re.sub(r"//[^\n]*", "", text), {}
    for package, body in re.findall(r"module (\w+) \{ module msg \{ module dds_ \{(.*?)\}; \}; \};", bare, re.S):
        for name, members in re.findall(r"struct (\w+)_ \{(.*?)\};", body, re.S):
            fields = [field(m.strip(), package) for m in members.split(";") if m.strip()]
            types[f"{package}/msg/{name}"] = {"type_name": f"{package}/msg/{name}", "fields": fields}
    return types


def below(name: str, types: dict[str, dict]) -> set[str]:
    nested = {f["type"]["nested_type_name"] for f in types[name]["fields"]} - {""}
    return nested.union(*(below(n, types) for n in nested))


def hash_of(name: str, types: dict[str, dict]) -> str:
    described = {"type_description": types[name],
                 "referenced_type_descriptions": [types[n] for n in sorted(below(name, types))]}
    return hashlib.sha256(json.dumps(described).encode()).hexdigest()


def main() -> int:
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1])
    types = types_of((root / "idl/ros2.idl").read_text()) | types_of((root / "idl/backwash_msgs.idl").read_text())
    hashes = {name: hash_of(name, types) for name in types}
    lines = (f'    {{"{n.replace("/msg/", "::msg::dds_::")}_", "RIHS01_{h}"}},\n' for n, h in hashes.items())
    described = "".join(f"    &{name.replace('/msg/', '_msg_dds__')}__desc,\n" for name in types)
    text = HEAD % described + "".join(lines) + TAIL
    if len(sys.argv) < 3:
        print(text, end="")
        return 0
    wrong = [f"{n}: {hashes.get(n)}, ROS 2 has {h}" for n, h in PUBLISHED.items() if hashes.get(n) != h]
    print("\n".join(wrong) or f"{len(hashes)} types, {len(PUBLISHED)} hashes as ROS 2 publishes them")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
