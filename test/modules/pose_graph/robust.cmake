km_test(pose_graph_robust
  SOURCES robust/test_gnc_codec.cpp robust/test_gnc_schedule.cpp robust/test_gnc_team.cpp
          robust/test_noise_scale.cpp robust/test_public_system.cpp
  LINK km_pose_graph_robust_node km_pose_graph_robust_team km_recorded_graph)
