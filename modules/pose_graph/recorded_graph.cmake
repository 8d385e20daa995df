# Pose graphs from files, without the solver: km_recorded_graph reads and writes them,
# km_recorded_graph_node plays one robot's part as if it were being driven.
add_library(km_recorded_graph STATIC g2o_io.cpp recorded_graph.cpp)
target_link_libraries(km_recorded_graph PUBLIC km_core)

km_node(recorded_graph SOURCES graph_playback_node.cpp)
