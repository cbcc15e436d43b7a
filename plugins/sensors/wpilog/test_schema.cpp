// Schemas of packed structs: the layouts of the specification's examples, refusals.
#include <gmock/gmock.h>

#include "message_of.hpp"
#include "schema.hpp"
#include "test_writer.hpp"
#include "viwo/api/status.hpp"

namespace viwo::wpilog {
namespace {

using ::testing::HasSubstr;

/// "offset:size" or "offset:size.shift+bits" of the numbers of a struct, then its size.
std::string layout_of(const std::string& schema) {
  Schemas schemas;
  schemas.add("S", schema);
  std::string out;
  const Layout& layout = schemas.layout("S");
  for (const Member& member : layout.members) {
    const Field& field = member.number;
    out += member.name + "@" + std::to_string(field.offset) + ":" + std::to_string(field.size);
    if (field.bits > 0) {
      out += "." + std::to_string(field.shift) + "+" + std::to_string(field.bits);
    }
    if (member.is_array) out += "x" + std::to_string(member.count);
    out += " ";
  }
  return out + std::to_string(layout.size);
}

std::string refusal_of(const std::string& schema) {
  return testing::error_of([&] { layout_of(schema); });
}

TEST(Schema, PutsMembersOneBehindTheOther) {
  EXPECT_EQ(layout_of("bool b;int16 i"), "b@0:1 i@1:2 3");
  EXPECT_EQ(layout_of("int16 i[2];"), "i@0:2x2 4");
  EXPECT_EQ(layout_of(" ;; float a ; \n double\tb [ 3 ] ;char c"), "a@0:4 b@4:8x3 c@28:1 29");
  EXPECT_EQ(layout_of("float32 a;float64 b;uint64 c;int8 d"), "a@0:4 b@4:8 c@12:8 d@20:1 21");
  EXPECT_EQ(layout_of(""), "0");
}

TEST(Schema, PacksBitFieldsAsTheSpecificationDoes) {
  EXPECT_EQ(layout_of("int8 a:4;int16 b:4"), "a@0:1.0+4 b@1:2.0+4 3");
  EXPECT_EQ(layout_of("int16 a:4;uint16 b:5;bool c:1;int16 d:7"),
            "a@0:2.0+4 b@0:2.4+5 c@0:2.9+1 d@2:2.0+7 4");
  EXPECT_EQ(layout_of("uint8 a:4;int8 b:2;bool c:1;int16 d:1"),
            "a@0:1.0+4 b@0:1.4+2 c@0:1.6+1 d@1:2.0+1 3");
  EXPECT_EQ(layout_of("bool a:1;bool b:1;int8 c:2"), "a@0:1.0+1 b@0:1.1+1 c@0:1.2+2 1");
  EXPECT_EQ(layout_of("bool a:1;bool b:1;int16 c:2"), "a@0:1.0+1 b@0:1.1+1 c@1:2.0+2 3");
  EXPECT_EQ(layout_of("int8 a:1;double x;int8 b:1"), "a@0:1.0+1 x@1:8 b@9:1.0+1 10");
}

TEST(Schema, RefusesMoreMembersThanAStructHas) {
  std::string many;
  for (int i = 0; i < 1001; ++i) many += "int8 m" + std::to_string(i) + ";";
  EXPECT_THAT(refusal_of(many), HasSubstr("too many members"));
}

TEST(Schema, PassesOverEnums) {
  EXPECT_EQ(layout_of("enum {a=1, b=2} int8 val"), "val@0:1 1");
  EXPECT_EQ(layout_of("enum{a=1,b=2,}uint32 v : 2;{a=1} int8 w;enum{} int16 u"),
            "v@0:4.0+2 w@4:1 u@5:2 7");
}

TEST(Schema, FindsNumbersInStructsWithinArraysOfStructs) {
  Schemas schemas;
  schemas.add("Inner", "int16 i;int8 x");
  schemas.add("Outer", "char c;Inner s;Inner t[2];float f[3]");
  EXPECT_EQ(schemas.layout("Outer").size, 1U + 3U + 6U + 12U);
  EXPECT_EQ(schemas.find("Outer", "c")->offset, 0U);
  EXPECT_EQ(schemas.find("Outer", "s/x")->offset, 3U);
  EXPECT_EQ(schemas.find("Outer", "t/1/i")->offset, 7U);
  EXPECT_EQ(schemas.find("Outer", "f/2")->offset, 18U);
  for (const char* none : {"", "s", "t", "t/1", "t/2/i", "t/-1/i", "t/i", "f", "f/3", "c/x", "z"}) {
    EXPECT_FALSE(schemas.find("Outer", none)) << none;
  }
  schemas.add("Rotation2d", "double value");
  schemas.add("Wrapped", "Rotation2d r");
  EXPECT_EQ(schemas.only_number("Wrapped")->size, 8U);
  EXPECT_FALSE(schemas.only_number("Inner"));
}

TEST(Field, ReadsNumbersOfEveryKind) {
  const std::string bytes = bytes_of(0xF7A5, 2) + number(-2.5) + bytes_of(0x40200000, 4);
  const auto read = [&](NumberType type, std::size_t offset, std::size_t size, unsigned shift = 0,
                        unsigned bits = 0) {
    return Field{type, offset, size, shift, bits}.read(bytes);
  };
  EXPECT_EQ(read(NumberType::kFloat, 2, 8), -2.5);
  EXPECT_EQ(read(NumberType::kFloat, 10, 4), 2.5);
  EXPECT_EQ(read(NumberType::kUnsigned, 0, 2), 63397.);
  EXPECT_EQ(read(NumberType::kSigned, 0, 2), -2139.);
  EXPECT_EQ(read(NumberType::kUnsigned, 0, 2, 4, 4), 10.);
  EXPECT_EQ(read(NumberType::kSigned, 0, 2, 4, 4), -6.);
  EXPECT_EQ(read(NumberType::kSigned, 0, 2, 8, 4), 7.);
  EXPECT_EQ(read(NumberType::kBool, 0, 2, 11, 1), 0.);
  EXPECT_EQ(read(NumberType::kBool, 0, 1), 1.);
}

TEST(Schema, RefusesWhatTheSpecificationDoes) {
  for (const char* wrong :
       {"double val:2", "int32 val[2]:2", "bool val:3", "int16 val:17", "int8 val:0", "enum",
        "enum{a=1 int8 x", "enum{} double x", "double", "double a, b", "double a[0]", "double a[]",
        "double a[2", "double a[x]", "enum {} T x", "double a[9999999999]", "double a[200000]"}) {
    EXPECT_THAT(refusal_of(wrong), HasSubstr("struct 'S': ")) << wrong;
  }
  EXPECT_THAT(refusal_of("Missing m"), HasSubstr("struct 'Missing': the log has no schema of it"));
}

TEST(Schema, RefusesStructsWithoutEnd) {
  Schemas schemas;
  schemas.add("A", "B b");
  schemas.add("B", "A a[2]");
  EXPECT_THROW(schemas.layout("A"), InputError);
  EXPECT_THROW(schemas.layout("B"), InputError);
  for (int i = 0; i < 100'000; ++i) {
    schemas.add("D" + std::to_string(i), "D" + std::to_string(i + 1) + " d");
  }
  schemas.add("D100000", "double x");
  EXPECT_THROW(schemas.layout("D0"), InputError);
  for (int i = 100'000; i > 99'969; --i) schemas.layout("D" + std::to_string(i));
  EXPECT_THROW(schemas.layout("D50"), InputError);
}

TEST(Schema, RefusesTwoVersionsOfOneStruct) {
  Schemas schemas;
  schemas.add("A", "double x");
  schemas.add("A", "double x");
  EXPECT_EQ(schemas.layout("A").size, 8U);
  schemas.add("A", "float x");
  EXPECT_THROW(schemas.layout("A"), InputError);
}

}  // namespace
}  // namespace viwo::wpilog
