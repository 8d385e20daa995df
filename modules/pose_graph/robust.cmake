# Graduated non-convexity: km_pose_graph_robust is one robot's part, km_pose_graph_robust_team a
# team of them in one process and the centralised reference, km_pose_graph_robust_node the messages.
add_library(km_pose_graph_robust STATIC
  robust/align_starts.cpp robust/gnc_agent.cpp robust/gnc_agent_weights.cpp robust/gnc_block.cpp
  robust/gnc_edges.cpp robust/gnc_schedule.cpp robust/loose_links.cpp robust/public_graph.cpp
  robust/public_system.cpp)
target_link_libraries(km_pose_graph_robust PUBLIC km_pose_graph_newton km_outlier_rejection)

add_library(km_pose_graph_robust_team STATIC
  robust/central_gnc.cpp robust/gnc_team.cpp robust/isolated_closures.cpp robust/noise_scale.cpp
  robust/staged_gnc_team.cpp)
target_link_libraries(km_pose_graph_robust_team PUBLIC km_pose_graph_robust km_pose_graph_team)

km_node(pose_graph_robust SOURCES robust/gnc_codec.cpp)
