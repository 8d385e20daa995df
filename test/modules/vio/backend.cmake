km_test(vio
  SOURCES test_preintegration.cpp test_residuals.cpp test_marginalization.cpp
          test_fixed_lag_smoother.cpp test_initialization.cpp test_vio.cpp
          test_recorded_odometry.cpp dense_stereo.cpp odometry_errors.cpp odometry_run.cpp
          recorded_tracking.cpp window_optimizer_ceres.cpp
  LINK km_vio_node km_dense_sensing km_sensors Ceres::ceres)

# Odometry on recorded data as in the table of results; run by hand.
add_executable(bench_vio bench_vio.cpp dense_stereo.cpp odometry_errors.cpp odometry_run.cpp
               recorded_tracking.cpp)
target_link_libraries(bench_vio PRIVATE km_options km_vio km_dense_sensing km_sensors)
