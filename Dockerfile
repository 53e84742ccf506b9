# Debian 12 with what Dermis needs, its program, and the first of the two commands of README.md:
#
#   docker build --tag dermis .
#   docker run --rm dermis                 # make run: co-simulate six scenes, print the table
#   docker run --rm dermis make test       # all checks
#   docker run --rm --publish 127.0.0.1:8317:8317 dermis target/release/dermis live sensor-1 --listen 0.0.0.0:8317
FROM rust:1.93-bookworm
RUN rustup component add rustfmt clippy
WORKDIR /dermis
COPY . .
RUN make setup program && rm -rf /var/lib/apt/lists/*
CMD ["make", "run"]
