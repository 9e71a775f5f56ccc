// AccessService: tokens are made known, listed and revoked, and who did what is told.
#pragma once

#include "lightmill/v1/access_service.grpc.pb.h"
#include "server/runtime/runtime.h"

namespace lightmill {

/// Thread-safe.
class AccessServiceImpl final : public v1::AccessService::CallbackService {
 public:
  explicit AccessServiceImpl(Runtime& runtime) : gate_(runtime.gate()), loop_(runtime.loop()) {}

  using Context = grpc::CallbackServerContext;
  using Unary = grpc::ServerUnaryReactor;

  Unary* CreateToken(Context*, const v1::CreateTokenRequest*, v1::Token*) override;
  Unary* ListTokens(Context*, const v1::ListTokensRequest*, v1::ListTokensResponse*) override;
  Unary* RevokeToken(Context*, const v1::RevokeTokenRequest*, v1::RevokeTokenResponse*) override;
  Unary* Enrol(Context*, const v1::EnrolRequest*, v1::Token*) override;
  Unary* ListActions(Context*, const v1::ListActionsRequest*, v1::ListActionsResponse*) override;

 private:
  std::string way_back(const TokenRecord& token, std::int64_t now_unix_s) const;

  Gate& gate_;
  FarmLoop& loop_;
};

}  // namespace lightmill
