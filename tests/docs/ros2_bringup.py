#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ros2/backwash_bringup shows what there is: each topic of its layouts is in docs/interfaces.md with a delivery that the layout's reader
matches, each plotted member is in idl/backwash_msgs.idl, each panel is placed once, and the launch file renames RViz's topics.

ros2_bringup.py SOURCE_DIR

A reader that asks for more than the writer offers is never matched, and the display stays empty without a word.
"""
import ast
import json
import pathlib
import re
import sys
from xml.etree import ElementTree


def topics_of(interfaces: str) -> dict[str, tuple[bool, bool]]:
    """Topic under NAMESPACE → whether its writer is reliable, and transient local."""
    rows = re.findall(r"^\| rt/NAMESPACE/(\w+) .*?\| (?:in|out) \| ([^|]+) \|", interfaces, re.M)
    return {name: ("reliable" in delivery, "transient local" in delivery) for name, delivery in rows}


def members_of(idl: str) -> dict[str, dict[str, str]]:
    bare = re.sub(r"//[^\n]*", "", idl)
    structs = re.findall(r"struct (\w+)_ \{(.*?)\};", bare, re.S)
    return {name: {m[1]: m[0] for m in re.findall(r"(\S+)\s+(\w+)\s*;", body)} for name, body in structs}


NUMBERS = {"double", "float", "long", "short"}


def wrong_in_rviz(text: str, interfaces: str) -> list[str]:
    topics = topics_of(interfaces)
    wrong = []
    blocks = re.findall(r"Topic:\n((?: {8}.*\n)+)", text)
    if not blocks:
        wrong.append("rviz: no topic")
    for block in blocks:
        said = dict(re.findall(r"^ +([\w ]+): (.+)$", block, re.M))
        name = said["Value"].removeprefix("/backwash/")
        if name == "/goal_pose" and "reliable, on `--topic` (/goal_pose)" in interfaces:  # RViz writes, backwashctl reads
            if said["Reliability Policy"] != "Reliable":
                wrong.append("rviz: its goals would not be read")
            continue
        if name not in topics:
            wrong.append(f"rviz: {said['Value']} is no topic of docs/interfaces.md")
            continue
        reliable, kept = topics[name]
        if said["Reliability Policy"] == "Reliable" and not reliable or said["Durability Policy"] == "Transient Local" and not kept:
            wrong.append(f"rviz: {said['Value']} asks for more than its writer offers")
        if kept and said["Durability Policy"] != "Transient Local":
            wrong.append(f"rviz: {said['Value']} would miss what was said before RViz started")
    return wrong


def placed(layout) -> list[str]:
    return [layout] if isinstance(layout, str) else placed(layout["first"]) + placed(layout["second"])


def values(node, keys: set[str]) -> list[str]:
    if isinstance(node, dict):
        return [v for k, v in node.items() if k in keys] + [x for v in node.values() for x in values(v, keys)]
    return [x for v in node for x in values(v, keys)] if isinstance(node, list) else []


def wrong_in_foxglove(layout: dict, interfaces: str, idl: dict) -> list[str]:
    panels, topics = layout["configById"], topics_of(interfaces)
    wrong = [] if sorted(placed(layout["layout"])) == sorted(panels) else ["foxglove: panels and places differ"]
    shown = [t for panel in panels.values() for t in panel.get("topics", {})] + values(panels, {"value", "topicPath", "topicToRender"})
    for path in shown:
        if path == "/diagnostics" and "rt/diagnostics" in interfaces:
            continue
        found = re.fullmatch(r"/backwash/(\w+)((?:\.\w+)*)", path)
        if not found or found[1] not in topics:
            wrong.append(f"foxglove: {path} is no topic of docs/interfaces.md")
            continue
        type_ = "Status" if found[2] else ""
        for member in filter(None, found[2].split(".")):
            members = idl.get(type_, {})
            if found[1] != "status" or member not in members:
                wrong.append(f"foxglove: {path}: no member {member}")
                break
            type_ = members[member].removesuffix("_")
    return wrong


# What ROS 2 has and the IDL does not say.
OF_ROS2 = {"String": {"data": "string"}, "Vector3Stamped": {"header": "Header_", "vector": "geometry_msgs::msg::dds_::Vector3_"}}


def types_of_recording(interfaces: str) -> dict[str, str]:
    return {topic: type_.rsplit("/", 1)[1] for topics, type_ in re.findall(r"^\| ((?:`/[\w/]+`(?:, )?)+) \| (\w+/msg/\w+) \|", interfaces, re.M)
            for topic in re.findall(r"`([^`]+)`", topics)}


def wrong_in_plotjuggler(name: str, text: str, types: dict[str, str], idl: dict) -> list[str]:
    """Each curve is TOPIC/member/…/number, with a topic that there is and members of its message; each plot has a curve."""
    root, known, wrong = ElementTree.fromstring(text), idl | OF_ROS2, []
    plots, curves = root.findall(".//plot"), [curve.get("name") for curve in root.iter("curve")]
    if len(plots) < 5 or not all(plot.findall("curve") for plot in plots):
        wrong.append(f"plotjuggler/{name}: {len(plots)} plots, and one of them may be empty")
    for splitter in root.iter("DockSplitter"):
        if not int(splitter.get("count")) == len(splitter) == len(splitter.get("sizes").split(";")):
            wrong.append(f"plotjuggler/{name}: a splitter counts other plots than it has")
    for curve in curves:
        topic = next((t for t in types if curve.startswith(t + "/")), None)
        type_ = types.get(topic)
        for member in curve[len(topic) + 1:].split("/") if topic else []:
            type_ = known.get((type_ or "").rsplit("::", 1)[-1].removesuffix("_"), {}).get(member)
        if type_ not in NUMBERS:
            wrong.append(f"plotjuggler/{name}: {curve} is no number of a message that there is")
    return wrong


def wrong_in_recorded(layout: dict, interfaces: str, idl: dict) -> list[str]:
    """The layout for raw logs: by its table of topics, and members of ROS 2's types."""
    types = types_of_recording(interfaces)
    panels = layout["configById"]
    wrong = [] if sorted(placed(layout["layout"])) == sorted(panels) else ["foxglove: panels and places of the recorded one differ"]
    if len(types) < 10:
        wrong.append(f"foxglove: only {len(types)} topics of a recording are told")
    shown = [t for panel in panels.values() for t in panel.get("topics", {})] + values(panels, {"value", "topicPath", "topicToRender"})
    known = idl | OF_ROS2
    for path in shown:
        topic, *members = path.split(".")
        type_ = types.get(topic)
        if not type_:
            wrong.append(f"foxglove: {path} is no topic of a recording")
        for member in members if type_ else []:
            type_ = known.get(type_.rsplit("::", 1)[-1].removesuffix("_"), {}).get(member)
            if not type_:
                wrong.append(f"foxglove: {path}: no member {member}")
                break
    return wrong


def wrong_in_launch(source: str, rviz: str) -> list[str]:
    names = [ast.literal_eval(node.value) for node in ast.parse(source).body
             if isinstance(node, ast.Assign) and node.targets[0].id == "TOPICS"]
    shown = re.findall(r"Value: /backwash/(\w+)", rviz)
    return [] if names and sorted(names[0]) == sorted(shown) else ["launch: TOPICS are not those of backwash.rviz"]


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    package = root / "ros2/backwash_bringup"
    interfaces = (root / "docs/interfaces.md").read_text()
    rviz, launch = (package / "rviz/backwash.rviz").read_text(), (package / "launch/backwash.launch.py").read_text()
    foxglove = json.loads((package / "foxglove/backwash.json").read_text())
    idl = members_of((root / "idl/backwash_msgs.idl").read_text())
    recorded = json.loads((package / "foxglove/recorded.json").read_text())
    every = idl | members_of((root / "idl/ros2.idl").read_text())
    wrong = wrong_in_recorded(recorded, interfaces, every) + wrong_in_rviz(rviz, interfaces) + wrong_in_foxglove(foxglove, interfaces, idl) + wrong_in_launch(launch, rviz)
    for name, types in (("recorded.xml", types_of_recording(interfaces)), ("backwash.xml", {"/backwash/status": "Status"})):
        wrong += wrong_in_plotjuggler(name, (package / "plotjuggler" / name).read_text(), types, every)
    manifest = (package / "package.xml").read_text()
    for module in re.findall(r"^from (\w+)", launch, re.M):
        if f"<exec_depend>{module}</exec_depend>" not in manifest:
            wrong.append(f"package.xml does not name {module}")
    print("\n".join(wrong) or "layouts and launch file name what there is")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
