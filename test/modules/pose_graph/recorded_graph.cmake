km_test(recorded_graph SOURCES test_g2o_io.cpp test_recorded_graph.cpp test_graph_playback.cpp
  LINK km_recorded_graph_node)
