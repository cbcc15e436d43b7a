// Texts of JSON files.
#include <gtest/gtest.h>

#include "viwo/eval/json.hpp"

namespace viwo {
namespace {

TEST(Json, IsUtf8WhateverItsTexts) {
  const nlohmann::json json = {{"na\xefve", {"caf\xe9", "caf\xc3\xa9"}}};
  const std::string text = json_text(json);
  EXPECT_EQ(
      text,
      "{\n  \"na\xef\xbf\xbdve\": [\n    \"caf\xef\xbf\xbd\",\n    \"caf\xc3\xa9\"\n  ]\n}\n");
  EXPECT_TRUE(nlohmann::json::accept(text));
}

}  // namespace
}  // namespace viwo
