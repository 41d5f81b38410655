"""What surrounds the integrators on a machine without an operating system, as LLVM's IR."""

from __future__ import annotations

HEAP = 1 << 20  # bytes; the integrators ask for a few arrays of flags at a time

HOST = f"""
@host.heap = internal global [{HEAP} x i8] zeroinitializer, align 64
@host.top = internal global i64 0
@host.held = internal global i64 0
@host.nothing = internal global [4 x i64] zeroinitializer, align 16

; memory is taken from the heap one behind the other, and all of it is free again when none is held
define ptr @malloc(i64 %size) nounwind {{
  %begin = load i64, ptr @host.top
  %behind = add i64 %begin, %size
  %more = add i64 %behind, 63
  %end = and i64 %more, -64
  %fits = icmp ule i64 %end, {HEAP}
  br i1 %fits, label %there, label %none
there:
  store i64 %end, ptr @host.top
  %before = load i64, ptr @host.held
  %now = add i64 %before, 1
  store i64 %now, ptr @host.held
  %place = getelementptr i8, ptr @host.heap, i64 %begin
  ret ptr %place
none:
  ret ptr null
}}

define void @free(ptr %place) nounwind {{
  %before = load i64, ptr @host.held
  %now = sub i64 %before, 1
  store i64 %now, ptr @host.held
  %last = icmp eq i64 %now, 0
  br i1 %last, label %empty, label %done
empty:
  store i64 0, ptr @host.top
  br label %done
done:
  ret void
}}

declare void @prepare(ptr, ptr)
declare void @timed.prepare(ptr, ptr)
declare void @timed(ptr, ptr, ptr, ptr, ptr)
declare i32 @start(ptr, ptr, i64, ptr, ptr)
declare i32 @advance(ptr, ptr, i64, i64, i64, ptr, ptr, i64)
declare i32 @outputs(ptr, ptr, i64, i64, ptr, ptr)

define void @live_prepare() nounwind {{
  call void @prepare(ptr @live.p, ptr @task.p)
  ret void
}}

define i32 @live_start() nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %status = call i32 @start(ptr @host.nothing, ptr @host.nothing, i64 %rhs, ptr @task, ptr @work)
  ret i32 %status
}}

define i32 @live_advance(i32 %rounds) nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %many = zext i32 %rounds to i64
  %status = call i32 @advance(ptr @host.nothing, ptr @host.nothing, i64 %rhs, i64 0, i64 0,
                              ptr @task, ptr @work, i64 %many)
  ret i32 %status
}}

define i32 @live_outputs() nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %out = ptrtoint ptr @out to i64
  %status = call i32 @outputs(ptr @host.nothing, ptr @host.nothing, i64 %rhs, i64 %out,
                              ptr @task, ptr @work)
  ret i32 %status
}}

define void @live_timed() nounwind {{
  call void @timed(ptr @live.t, ptr @live.t, ptr @live.t, ptr @live.c, ptr @live.s)
  ret void
}}

define void @live_timed_prepare() nounwind {{
  call void @timed.prepare(ptr @live.p, ptr @live.c)
  ret void
}}
"""
HOST_FUNCTIONS = (
    "live_prepare", "live_start", "live_advance", "live_outputs", "live_timed",
    "live_timed_prepare",
)  # fmt: skip
