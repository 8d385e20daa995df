# Distributed pose graph optimisation: km_pose_graph is the algorithm, km_pose_graph_node its thread.
km_module(pose_graph
  SOURCES block_cholesky.cpp certificate.cpp certificate_agent.cpp chordal.cpp frame_alignment.cpp
          local_graph.cpp quadratic_problem.cpp
          rbcd_agent.cpp rbcd_session.cpp rbcd_sweep.cpp round_ledger.cpp rounding.cpp session_block.cpp
          session_plan.cpp staircase.cpp stiefel.cpp truncated_newton.cpp)

km_node(pose_graph SOURCES pose_graph_codec.cpp pose_graph_node.cpp)
