#include "server/web/web_server.h"

#include "common/base/address.h"
#include "common/base/log.h"
#include "server/api/listen_problem.h"
#include "server/api/records.h"
#include "server/web/http_session.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 1'024;
constexpr auto kAcceptPause = std::chrono::milliseconds(100);
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

FarmGreeting greeting_of(const WebOptions& options, const Gate& gate) {
  return {options.version, options.notices, {}, gate.asks()};
}

LiveHub::OnRefused recording_refusals(FarmLoop& loop, const Gate& gate) {
  return [&loop, &gate](const Call& call, JobId job, const Status& status) {
    (void)loop.post(
        [&gate, call, job, status](FarmLoop::Turn& turn) { record(turn, gate, call, {job.value}, status); });
  };
}

void accept_next(WebParts& parts) {
  parts.acceptor->async_accept([&parts](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) {
      return;
    }
    if (error) {  // as when there are too many open files: at once it would be the same again
      spdlog::debug("the page cannot accept a connection: {}; it tries again in {} ms", error.message(),
                    kAcceptPause.count());
      parts.pause->expires_after(kAcceptPause);
      parts.pause->async_wait([&parts](error_code ended) {
        if (!ended) {
          accept_next(parts);
        }
      });
      return;
    }
    if (parts.connections < kMostConnections) {
      socket.set_option(tcp::no_delay(true), error);
      start_http_session(parts, std::move(socket));
    }
    accept_next(parts);
  });
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

/// Reads the certificate again whenever it is renewed; what is wrong with it, the upkeep says.
void renew_on(WebParts& parts) {
  parts.renewal->expires_after(kRenewalInterval);
  parts.renewal->async_wait([&parts](error_code error) {
    if (!error) {
      (void)parts.certificate.look(system_clock().unix_milliseconds() / 1000);
      renew_on(parts);
    }
  });
}

Status listen_on(asio::io_context& io, tcp::acceptor& acceptor, const HostPort& listen) {
  error_code error;
  const auto found = tcp::resolver(io).resolve(listen.host, std::to_string(listen.port), error);
  const tcp::endpoint endpoint = error ? tcp::endpoint() : found.begin()->endpoint();
  for (const auto& step : std::initializer_list<std::function<void()>>{
           [&] { acceptor.open(endpoint.protocol(), error); },
           [&] { acceptor.set_option(tcp::acceptor::reuse_address(true), error); },
           [&] { acceptor.bind(endpoint, error); }, [&] { acceptor.listen(128, error); }}) {
    if (!error) {
      step();
    }
  }
  return error ? unavailable("{}", error.message()) : ok_status();
}

}  // namespace

Result<std::unique_ptr<WebServer>> WebServer::start(FarmLoop& loop, const Gate& gate, AssetStore& assets,
                                                    const WebOptions& options) {
  LM_ASSIGN_OR_RETURN(const HostPort listen, parse_host_port(options.listen));
  ServedCertificate certificate(options.tls);
  LM_RETURN_IF_ERROR(certificate.look(system_clock().unix_milliseconds() / 1000));
  if (!is_loopback(listen.host) && certificate.context() == nullptr && !options.open_to_all) {
    return invalid_argument("{}: without a certificate the page is served to this machine alone", options.listen);
  }
  Result<PageFiles> pages = PageFiles::load(options.pages);
  if (!pages.ok()) {
    spdlog::warn("the API is served without the page: {}", message_of(pages.status()));
    pages = PageFiles();
  }
  auto parts = std::make_unique<WebParts>(loop, gate, assets, options, std::move(certificate), *std::move(pages));
  if (!listen_on(*parts->io, *parts->acceptor, listen).ok()) {
    return unavailable("cannot listen on {}: {}", options.listen, listen_problem(options.listen, "--http"));
  }
  accept_next(*parts);
  tick_on(*parts);
  if (parts->certificate.context() != nullptr) {
    renew_on(*parts);
  }
  parts->thread = std::thread([io = &*parts->io] { io->run(); });
  return std::unique_ptr<WebServer>(new WebServer(std::move(parts)));
}

WebParts::WebParts(FarmLoop& loop, const Gate& gate_of_all, AssetStore& all_assets, const WebOptions& web,
                   ServedCertificate served, PageFiles files)
    : gate(gate_of_all),
      assets(all_assets),
      traffic(loop.traffic()),
      options(web),
      pages(std::move(files)),
      certificate(std::move(served)),
      logins(loop, gate, system_clock()),
      hub(loop, greeting_of(options, gate), posting_to(mailbox), system_clock(), recording_refusals(loop, gate)),
      acceptor(*io),
      ticker(*io),
      pause(*io),
      renewal(*io),
      api(std::in_place,
          ApiParts{loop, gate, assets, logins, greeting_of(options, gate), posting_to(mailbox), running_on(side)}) {
  mailbox->set(&*io);
}

/// Connections die with what waits for them: the side threads' tasks, replies of the API, or `io`.
WebParts::~WebParts() {
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
  pause.reset();
  renewal.reset();
  acceptor.reset();
  io.reset();
}

WebServer::WebServer(std::unique_ptr<WebParts> parts) : parts_(std::move(parts)) {}

WebServer::~WebServer() = default;

int WebServer::port() const {
  return parts_->acceptor->local_endpoint().port();
}

}  // namespace lightmill
