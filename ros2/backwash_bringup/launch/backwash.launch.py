# SPDX-License-Identifier: BSD-3-Clause
"""Starts backwashd, and RViz beside it.

ros2 launch backwash_bringup backwash.launch.py configuration:=/etc/backwash/backwashd.toml namespace:=backwash rviz:=true

The daemon is a process of its own and no ROS node: its topics, frames and domain stand in its configuration, and `namespace` here only
tells RViz which of them to show. On a vehicle systemd starts it; this file is for the bench. The launch ends with the daemon.
"""
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, RegisterEventHandler
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TOPICS = ["odometry", "points", "trajectory", "markers", "disturbance"]  # those of rviz/backwash.rviz


def generate_launch_description():
    layout = get_package_share_directory("backwash_bringup") + "/rviz/backwash.rviz"
    namespace = LaunchConfiguration("namespace")
    daemon = ExecuteProcess(cmd=["backwashd", "--config", LaunchConfiguration("configuration")], output="screen")
    return LaunchDescription([
        DeclareLaunchArgument("configuration", description="the daemon's backwashd.toml"),
        DeclareLaunchArgument("namespace", default_value="backwash", description="dds.namespace of that file"),
        DeclareLaunchArgument("rviz", default_value="true", description="false: the daemon alone"),
        daemon,
        Node(package="rviz2", executable="rviz2", arguments=["-d", layout], condition=IfCondition(LaunchConfiguration("rviz")),
             remappings=[(f"/backwash/{topic}", ["/", namespace, f"/{topic}"]) for topic in TOPICS]),
        RegisterEventHandler(OnProcessExit(target_action=daemon, on_exit=[EmitEvent(event=Shutdown(reason="backwashd has ended"))])),
    ])
