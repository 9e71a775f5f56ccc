#include "server/web/web_server.h"

#include <unistd.h>

#include "common/base/address.h"
#include "common/base/log.h"
#include "lightmill/v1/render_service.pb.h"
#include "server/operations/operation_call.h"
#include "server/runtime/action_records.h"
#include "server/web/web_parts.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr auto kRenewalInterval = std::chrono::seconds(2);

OnWebThread posting_to(const std::shared_ptr<Mailbox>& mailbox) {
  return [mailbox](std::function<void()> task) { mailbox->post(std::move(task)); };
}

OnSideThread running_on(const std::shared_ptr<asio::thread_pool>& threads) {
  return [weak = std::weak_ptr(threads)](std::function<void()> task) {
    if (const auto there = weak.lock()) {
      asio::post(*there, std::move(task));
    }
  };
}

FarmGreeting greeting_of(const WebOptions& options, Runtime& runtime) {
  return {options.version, runtime.options().notices, {}};
}

LiveHub::OnRefused recording_refusals(FarmLoop& loop, const AccessControl& access) {
  return [&loop, &access](const Call& call, JobId job, const Status& status) {
    (void)loop.post([&access, call, job, status](FarmLoop::TaskContext& context) {
      record(context, access, call, {job.value}, status);
    });
  };
}

PageJobs::Discard discarding(Runtime& runtime, const OnWebThread& on_web_thread) {
  return [&runtime, on_web_thread](const Call& call, JobId job, const std::function<void(bool)>& done) {
    const auto deletion = std::make_shared<OperationCall>(runtime, *find_operation("DeleteJob"));
    auto& request = static_cast<v1::DeleteJobRequest&>(deletion->request());
    request.set_id(job.value);
    request.set_cancel(true);
    deletion->start(call, [on_web_thread, done](const Status& status) {
      on_web_thread([done, gone = status.ok() || status.code() == StatusCode::kNotFound] { done(gone); });
    });
  };
}

/// Serves a socket that the listener has accepted.
void serve(WebParts& parts, int socket, const std::string& peer) {
  error_code error;
  tcp::socket connection(*parts.io);
  connection.assign(peer.starts_with('[') ? tcp::v6() : tcp::v4(), socket, error);
  if (error) {
    ::close(socket);
    return;
  }
  start_http_session(parts, std::move(connection), peer);
}

void tick_on(WebParts& parts) {
  parts.ticker->expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(LiveHub::kTick));
  parts.ticker->async_wait([&parts](error_code error) {
    if (!error) {
      parts.hub.tick();
      tick_on(parts);
    }
  });
}

/// Reads a renewed certificate. HostMonitor reports its errors.
void renew_on(WebParts& parts) {
  parts.renewal->expires_after(kRenewalInterval);
  parts.renewal->async_wait([&parts](error_code error) {
    if (!error) {
      (void)parts.certificate.reload(system_clock().unix_milliseconds() / 1000);
      renew_on(parts);
    }
  });
}

}  // namespace

Result<std::unique_ptr<WebServer>> WebServer::start(Runtime& runtime, const WebOptions& options) {
  LM_ASSIGN_OR_RETURN(const HostPort listen, parse_host_port(options.listen));
  ServedCertificate certificate(options.tls);
  LM_RETURN_IF_ERROR(certificate.reload(system_clock().unix_milliseconds() / 1000));
  if (!is_loopback(listen.host) && certificate.context() == nullptr && !options.open_to_all) {
    return invalid_argument("{}: without a certificate, the page is served only to this machine", options.listen);
  }
  Result<PageFiles> pages = PageFiles::load(options.pages);
  if (!pages.ok()) {
    spdlog::warn("the API is served without the page: {}", message_of(pages.status()));
    pages = PageFiles();
  }
  auto parts = std::make_unique<WebParts>(runtime, options, std::move(certificate), *std::move(pages));
  LM_ASSIGN_OR_RETURN(parts->listener, Listener::open(options.listen, "--http", options.connections));
  tick_on(*parts);
  if (parts->certificate.context() != nullptr) {
    renew_on(*parts);
  }
  parts->thread = std::thread([io = &*parts->io] { io->run(); });
  parts->listener->start([parts = parts.get()](int socket, const std::string& peer) {
    asio::post(*parts->io, [parts, socket, peer] { serve(*parts, socket, peer); });
  });
  return std::unique_ptr<WebServer>(new WebServer(std::move(parts)));
}

WebParts::WebParts(Runtime& runtime, const WebOptions& web, ServedCertificate served, PageFiles files)
    : access(runtime.access()),
      assets(runtime.assets()),
      traffic(runtime.loop().traffic()),
      options(web),
      pages(std::move(files)),
      certificate(std::move(served)),
      authenticator(runtime.loop(), access, system_clock()),
      hub(runtime.loop(), greeting_of(options, runtime), posting_to(mailbox), system_clock(),
          recording_refusals(runtime.loop(), access), options.view_bytes, discarding(runtime, posting_to(mailbox))),
      ticker(*io),
      renewal(*io),
      api(std::in_place, ApiParts{runtime, authenticator, hub.page_jobs(), greeting_of(options, runtime),
                                  posting_to(mailbox), running_on(side), options.file_bytes}) {
  mailbox->set(&*io);
}

/// Connections are destroyed with what holds them: tasks of the side threads, replies of the API, or `io`.
WebParts::~WebParts() {
  if (listener != nullptr) {
    listener->stop();
  }
  mailbox->set(nullptr);
  io->stop();
  if (thread.joinable()) {
    thread.join();
  }
  for (std::shared_ptr<asio::thread_pool>* const threads : {&side, &disk}) {
    (*threads)->stop();
    (*threads)->join();
    threads->reset();
  }
  api.reset();
  ticker.reset();
  renewal.reset();
  io.reset();
}

WebServer::WebServer(std::unique_ptr<WebParts> parts) : parts_(std::move(parts)) {}

WebServer::~WebServer() = default;

int WebServer::port() const {
  return parts_->listener->port();
}

}  // namespace lightmill
