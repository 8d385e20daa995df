km_test(pose_graph
  SOURCES test_chordal.cpp test_frame_alignment.cpp test_local_graph.cpp test_quadratic_problem.cpp
          test_pgo_agent.cpp test_pgo_exchange.cpp test_pgo_gnc.cpp test_pgo_robustness.cpp test_pgo_tunnels.cpp test_session_plan.cpp
          test_stiefel.cpp test_truncated_newton.cpp test_vertical_prior.cpp
  LINK km_pose_graph_agent km_recorded_graph km_outlier_rejection)
km_test(pose_graph_node SOURCES test_pose_graph_codec.cpp test_pose_graph_node.cpp
          test_solver_message_codec.cpp
  LINK km_pose_graph_node km_recorded_graph)
