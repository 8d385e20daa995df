km_test(pose_graph_team
  SOURCES test_asynchronous_team.cpp test_block_cholesky.cpp test_certificate.cpp
          test_team_graph_file.cpp test_team_solvers.cpp
  LINK km_pose_graph_team)
