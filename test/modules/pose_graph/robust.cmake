km_test(pose_graph_robust
  SOURCES robust/test_gnc_codec.cpp robust/test_gnc_schedule.cpp robust/test_gnc_team.cpp
  LINK km_pose_graph_robust_node km_pose_graph_robust_team km_recorded_graph)
