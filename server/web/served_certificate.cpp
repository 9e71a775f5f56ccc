#include "server/web/served_certificate.h"

#include <boost/asio/buffer.hpp>

namespace lightmill {

Status ServedCertificate::reload(std::int64_t now_unix_s) {
  if (files_.certificate.empty()) {
    return ok_status();
  }
  const TlsFiles own{"", files_.certificate, files_.key};  // callers use tokens here, not certificates
  LM_ASSIGN_OR_RETURN(TlsTexts texts, read_tls_files(own, now_unix_s));
  if (context_ != nullptr && texts.certificate == texts_.certificate && texts.key == texts_.key) {
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts, read_certificates(texts.certificate));
  using boost::asio::ssl::context;
  auto made = std::make_shared<context>(context::tls_server);
  boost::system::error_code error;
  made->set_options(context::default_workarounds | context::no_sslv2 | context::no_sslv3 | context::no_tlsv1 |
                        context::no_tlsv1_1 | context::no_compression,
                    error);
  if (!error) {
    made->use_certificate_chain(boost::asio::buffer(texts.certificate), error);
  }
  if (!error) {
    made->use_private_key(boost::asio::buffer(texts.key), context::pem, error);
  }
  if (error) {
    return failed_precondition("{} {}: {}", kCertificateOption, files_.certificate, error.message());
  }
  texts_ = std::move(texts);
  hosts_ = facts.front().hosts;
  context_ = std::move(made);
  return ok_status();
}

}  // namespace lightmill
