km_test(pose_graph_newton
  SOURCES newton/test_edge_model.cpp newton/test_elimination.cpp newton/test_newton_codec.cpp
          newton/test_newton_team.cpp newton/test_vertical_teams.cpp
  LINK km_pose_graph_newton_node km_pose_graph_newton_team km_recorded_graph)
