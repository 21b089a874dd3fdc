# The two commands of the README. Both install what the system lacks (see .ci/setup).

.PHONY: demo test
.SILENT:

# A picture of a metal ring and its caustic.
demo:
	.ci/setup demo
	cargo build --release
	./target/release/nephroid render assets/scenes/ring.toml -o ring.png

# All tests, under the validation layers. Two at a time: each keeps the device busy by itself.
test:
	.ci/setup test
	cargo test --release -- --test-threads=2
