#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// White normal noise, CV_32F.
inline cv::Mat white_noise(int width, int height, double sigma, std::mt19937& random) {
  std::normal_distribution<float> normal(0.0F, static_cast<float>(sigma));
  cv::Mat noise(height, width, CV_32F);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) noise.at<float>(y, x) = normal(random);
  return noise;
}

/// A surface with blobs of a few pixels everywhere, with corners to track. 8-bit grey.
inline cv::Mat texture(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  cv::Mat blobs;
  cv::GaussianBlur(white_noise(width, height, 1.0, random), blobs, cv::Size(), 2.5);
  cv::Scalar mean, deviation;
  cv::meanStdDev(blobs, mean, deviation);
  cv::Mat image;
  blobs.convertTo(image, CV_8U, 40.0 / deviation[0], 128.0);
  return image;
}

/// The part of `surface` that a camera of the given size sees at (x, y).
inline cv::Mat view_of(const cv::Mat& surface, int x, int y, int width, int height) {
  return surface(cv::Rect(x, y, width, height)).clone();
}

/// An image of one grey level with white noise.
inline cv::Mat noisy_wall(int width, int height, double grey, double sigma, std::mt19937& random) {
  cv::Mat image;
  white_noise(width, height, sigma, random).convertTo(image, CV_8U, 1.0, grey);
  return image;
}

/// Two cameras side by side with equal views of points at infinity.
inline StereoRig aligned_rig(int width, int height, double focal_px) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal_px;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  StereoRig rig;
  rig.cameras = {camera, camera};
  rig.cameras[1].T_body_cam.translation().x() = 0.1;
  return rig;
}

inline std::vector<ImageFigure> figures_of(const auto& statistics) {
  std::vector<ImageFigure> figures;
  statistics.append_to(figures);
  return figures;
}

/// Value of a figure; throws if there is none of this name.
inline double figure(const std::vector<ImageFigure>& figures, const std::string& section,
                     const std::string& name) {
  for (const ImageFigure& f : figures)
    if (f.section.starts_with(section) && f.name == name) return f.value;
  throw std::invalid_argument("no figure " + section + ": " + name);
}

}  // namespace km
