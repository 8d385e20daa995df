#pragma once

#include <civetweb.h>

#include "test/support/patience.hpp"
#include "test/support/test.hpp"

namespace km {

/// A page without a browser: collects the frames it is sent.
class PageListener {
 public:
  PageListener(int port, const std::string& path) {
    std::array<char, 256> error{};
    connection_ = mg_download("127.0.0.1", port, 0, error.data(), error.size(),
                              "POST %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nContent-Length: 0\r\n\r\n",
                              path.c_str(), port);
    INFO(error.data());
    REQUIRE(connection_ != nullptr);
    status_ = mg_get_response_info(connection_)->status_code;
    reader_ = std::thread([this] { read(); });
  }
  ~PageListener() {
    gone_ = true;
    reader_.join();
    mg_close_connection(connection_);
  }
  PageListener(const PageListener&) = delete;
  PageListener& operator=(const PageListener&) = delete;

  [[nodiscard]] int status() const { return status_; }

  /// Waits until the frames hold this.
  bool receives(const std::string& text) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return all_.find(text) != std::string::npos; });
  }

 private:
  // Empty frames arrive several times a second, so that reading ends soon. mg_read() returns when
  // all bytes that it is asked for have arrived.
  void read() {
    for (char byte = 0; !gone_ && mg_read(connection_, &byte, 1) > 0;) {
      const std::lock_guard lock(mutex_);
      all_ += byte;
      changed_.notify_all();
    }
  }

  mg_connection* connection_ = nullptr;
  int status_ = 0;
  std::atomic<bool> gone_ = false;
  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::string all_;
  std::thread reader_;
};

}  // namespace km
