km_module(vio_frontend
  SOURCES depth_matcher.cpp feature_detector.cpp feature_tracker.cpp feature_tracker_outliers.cpp image_pyramid.cpp
          klt.cpp local_warp.cpp patch_alignment.cpp patch_template.cpp stereo_matcher.cpp
          stereo_motion.cpp two_point_ransac.cpp
  LINK km_images)
