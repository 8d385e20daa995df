#include "modules/images/network.hpp"

#include <opencv2/imgproc.hpp>

#include "modules/images/image_view.hpp"

namespace km {

cv::dnn::Net read_onnx(const std::string& model) {
  cv::dnn::Net net = cv::dnn::readNetFromONNX(model.data(), model.size());
  net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  return net;
}

std::string reason_of(const cv::Exception& error) {
  std::string text = error.err.empty() ? error.what() : error.err;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::string shape_text(std::span<const int> sizes) {
  std::string text;
  for (const int size : sizes) text += (text.empty() ? "" : " x ") + std::to_string(size);
  return text.empty() ? "unknown" : text;
}

cv::Mat resized(const GrayImage& image, cv::Size size) {
  cv::Mat result;
  cv::resize(view(image), result, size, 0.0, 0.0,
             image.width > size.width ? cv::INTER_AREA : cv::INTER_LINEAR);
  return result;
}

}  // namespace km
