# docker build -t shellock . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" shellock build figure.stl
FROM rust:1-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev binutils git && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN scripts/release /dist && mkdir /release && tar -xzf /dist/*.tar.gz -C /release --strip-components=1

FROM scratch
COPY --from=build /release/shellock /release/shellock-check /bin/
COPY --from=build /release/LICENSE-* /licenses/
WORKDIR /work
ENTRYPOINT ["/bin/shellock"]
