km_module(vio
  SOURCES fixed_lag_sliding.cpp fixed_lag_smoother.cpp initialization.cpp marginalization.cpp preintegration.cpp
          residuals/imu_cost.cpp residuals/imu_factor.cpp residuals/pose_block.cpp
          residuals/prior_cost.cpp residuals/reprojection.cpp residuals/reprojection_cost.cpp
          residuals/retraction.cpp stereo_odometry.cpp triangulation.cpp vio.cpp vio_keyframes.cpp
          window.cpp window_equations.cpp window_optimizer.cpp window_optimizer_ceres.cpp
          window_sliding.cpp
  LINK km_vio_frontend)
target_link_libraries(km_vio PRIVATE Ceres::ceres)  # no public header includes it

km_node(vio SOURCES vio_node.cpp)
