# Distributed pose graph optimisation: km_pose_graph is the algorithm, km_pose_graph_node its thread.
km_module(pose_graph
  SOURCES block_cholesky.cpp chordal.cpp quadratic_problem.cpp rounding.cpp stiefel.cpp
          truncated_newton.cpp)
