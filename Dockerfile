# The program `trace` with all that ships, on Debian 12; without `train`, which needs libtorch.
#
#   docker build -t furrow:0.1.0 .
#   docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" furrow:0.1.0 --scene field --spp 16
#
# `trace dataset emit --scheduler kubernetes` names this image unless --image says another.
FROM rust:1.89-bookworm AS build
RUN apt-get update && apt-get install -y --no-install-recommends libembree-dev && rm -rf /var/lib/apt/lists/*
COPY . /src
WORKDIR /src
RUN cargo build --release --locked --bin trace && strip target/release/trace

FROM debian:bookworm-slim
RUN apt-get update && apt-get install -y --no-install-recommends libembree3-3 && rm -rf /var/lib/apt/lists/*
COPY --from=build /src/target/release/trace /usr/local/bin/
COPY scenes/ /usr/local/share/furrow/scenes/
COPY textures/ /usr/local/share/furrow/textures/
WORKDIR /work
ENTRYPOINT ["trace"]
CMD ["--help"]
