km_module(vio
  SOURCES fixed_lag_sliding.cpp fixed_lag_smoother.cpp imu_factor.cpp initialization.cpp
          marginalization.cpp preintegration.cpp reprojection.cpp stereo_odometry.cpp
          triangulation.cpp vio.cpp vio_keyframes.cpp window.cpp window_equations.cpp
          window_optimizer.cpp window_sliding.cpp
  LINK km_vio_frontend)

km_node(vio SOURCES vio_node.cpp)
