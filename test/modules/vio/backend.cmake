add_executable(bench_vio bench_vio.cpp odometry_errors.cpp odometry_run.cpp recorded_tracking.cpp)
target_link_libraries(bench_vio PRIVATE km_options km_vio km_sensors)
