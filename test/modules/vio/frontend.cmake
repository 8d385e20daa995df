if(TARGET km_sensors)  # reads the recording
km_test(vio_frontend
  SOURCES test_feature_detector.cpp test_feature_tracker.cpp test_outlier_tests.cpp test_patches.cpp
          test_rgbd_tracking.cpp test_recorded_tracking.cpp recorded_tracking.cpp
  LINK km_vio_frontend km_sensors)
km_benchmark(tracking
  SOURCES bench_tracking.cpp recorded_tracking.cpp
  LINK km_vio_frontend km_sensors)
endif()
