# A team of robots in one process, for tools and tests: any method, measured round by round.
add_library(km_pose_graph_team STATIC
  team/asynchronous_team.cpp team/block_descent_accelerated.cpp team/block_descent_team.cpp
  team/central_team.cpp team/gauss_seidel_team.cpp team/least_squares_block.cpp
  team/local_team.cpp team/proximal_block.cpp team/team_graph.cpp team/team_graph_file.cpp
  team/team_schedule.cpp team/team_solver.cpp team/team_staircase.cpp team/team_verification.cpp)
target_link_libraries(km_pose_graph_team PUBLIC km_pose_graph km_recorded_graph)
