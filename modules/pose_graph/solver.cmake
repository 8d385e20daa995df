# Distributed pose graph optimisation: km_pose_graph holds the parts, km_pose_graph_agent one
# robot's state machine, km_pose_graph_node its thread and its messages on the wire.
km_module(pose_graph
  SOURCES block_cholesky.cpp certificate.cpp certificate_agent.cpp chordal.cpp frame_alignment.cpp
          local_graph.cpp quadratic_problem.cpp round_ledger.cpp rounding.cpp session_block.cpp
          session_plan.cpp staircase.cpp stiefel.cpp truncated_newton.cpp
          vertical_prior.cpp)

add_library(km_pose_graph_agent STATIC
  newton/newton_session_solver.cpp pgo_agent.cpp pgo_block.cpp pgo_exchange.cpp pgo_session.cpp
  pgo_sweep.cpp robust/gnc_session_solver.cpp session_solver.cpp solver_message.cpp)
target_link_libraries(km_pose_graph_agent PUBLIC km_pose_graph_newton km_pose_graph_robust)

km_node(pose_graph SOURCES pose_graph_codec.cpp pose_graph_node.cpp solver_message_codec.cpp
        LINK km_pose_graph_agent km_pose_graph_newton_node km_pose_graph_robust_node)
