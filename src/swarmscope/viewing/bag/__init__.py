"""A run as an MCAP file of ROS 2 messages, which Foxglove, Rerun and rosbag2 open."""
