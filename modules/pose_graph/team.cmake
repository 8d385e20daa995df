# A team of robots in one process, for tools and tests: any method, measured round by round.
add_library(km_pose_graph_team STATIC team/team_graph.cpp team/team_solver.cpp)
target_link_libraries(km_pose_graph_team PUBLIC km_pose_graph)
