km_test(pose_graph
  SOURCES test_chordal.cpp test_frame_alignment.cpp test_quadratic_problem.cpp test_rbcd_agent.cpp
          test_stiefel.cpp test_truncated_newton.cpp
  LINK km_pose_graph km_recorded_graph)
