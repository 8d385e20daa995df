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
    connection_ = mg_connect_websocket_client(
        "127.0.0.1", port, 0, error.data(), error.size(), path.c_str(), nullptr,
        [](mg_connection*, int, char* data, size_t size, void* self) {
          static_cast<PageListener*>(self)->receive({data, size});
          return 1;
        },
        [](const mg_connection*, void* self) { static_cast<PageListener*>(self)->close(); }, this);
    INFO(error.data());
    REQUIRE(connection_ != nullptr);
  }
  ~PageListener() { mg_close_connection(connection_); }

  void send(const std::string& text) {
    mg_websocket_client_write(connection_, MG_WEBSOCKET_OPCODE_TEXT, text.data(), text.size());
  }

  /// Waits until a frame holds this.
  bool receives(const std::string& text) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return all_.find(text) != std::string::npos; });
  }

  /// Waits until the server has closed the connection.
  bool is_closed() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return closed_; });
  }

 private:
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  void receive(std::string_view frame) {
    const std::lock_guard lock(mutex_);
    all_.append(frame);
    changed_.notify_all();
  }

  mg_connection* connection_ = nullptr;
  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::string all_;
  bool closed_ = false;
};

}  // namespace km
