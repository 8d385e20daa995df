# Newton's method for a team: km_pose_graph_newton is one robot's part, km_pose_graph_newton_team
# a team of them in one process, km_pose_graph_newton_node the messages on the wire.
add_library(km_pose_graph_newton STATIC
  newton/edge_model.cpp newton/elimination_plan.cpp newton/frontal_cholesky.cpp
  newton/link_cover.cpp newton/newton_agent.cpp newton/newton_agent_start.cpp newton/robot_graph.cpp
  newton/robot_system.cpp newton/separator_system.cpp newton/sparse_choice.cpp newton/team_step.cpp
  newton/wire_blocks.cpp)
target_link_libraries(km_pose_graph_newton PUBLIC km_pose_graph)

add_library(km_pose_graph_newton_team STATIC newton/newton_team.cpp)
target_link_libraries(km_pose_graph_newton_team PUBLIC km_pose_graph_newton km_pose_graph_team)

km_node(pose_graph_newton SOURCES newton/newton_codec.cpp)
