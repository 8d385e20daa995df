#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <string>

#include "apps/viewer/view_store.hpp"
#include "modules/charts/html_page.hpp"
#include "modules/core/ids.hpp"

struct mg_connection;
struct mg_context;

namespace km {

/// All files of the page: those in apps/viewer/page, the parts shared with other programs' pages,
/// and three.js under the names that its modules import.
[[nodiscard]] std::span<const PageFile> page_files();

struct PageServerOptions {
  std::string address = "127.0.0.1";  ///< If not a loopback address, URLs need the token.
  int port = 8777;                    ///< 0: any free port.
  std::string hello;                  ///< See hello_message().
  /// Called with the robots whose images some page requests, when this set has changed. Calls are
  /// in the order of the changes, by one thread at a time.
  std::function<void(const std::set<RobotId>&)> on_images;
};

/// Serves the page, and as one endless answer all present and future messages of a store. Bodies of
/// requests are not read. Refuses requests whose Origin is another site. A server without a token
/// (see PageServerOptions::address) also refuses requests whose host is not a name of this host.
class PageServer {
 public:
  /// `store` must outlive the server. Throws std::runtime_error that names address and port if they
  /// cannot be used.
  PageServer(ViewStore& store, PageServerOptions options);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Address to open in a browser, with the token if there is one.
  [[nodiscard]] std::string url() const;

 private:
  struct Page {
    std::string address;
    std::set<RobotId> images;  // robots whose images the page requests
  };

  [[nodiscard]] std::string prefix() const { return token_.empty() ? "/" : '/' + token_ + '/'; }
  void start();
  bool is_allowed(const mg_connection* connection) const;
  int serve(mg_connection* connection);
  int send_messages(mg_connection* connection);
  int request_images(mg_connection* connection);
  bool open(const std::string& id, const std::string& address);
  void change_requests(const std::function<void()>& change);
  [[nodiscard]] std::set<RobotId> requested() const;

  ViewStore& store_;
  const PageServerOptions options_;
  const std::string token_;
  std::atomic<bool> stopping_ = false;
  mg_context* context_ = nullptr;
  std::mutex mutex_;                   // guards the members below
  std::map<std::string, Page> pages_;  // open pages by the ids that they have chosen
};

}  // namespace km
